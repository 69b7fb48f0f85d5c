! One joint from Fortran: closed in ten steps, then sheared in ten, printed as CSV.
module jointlaw
  use, intrinsic :: iso_c_binding
  implicit none
  interface
    type(c_ptr) function jlaw_read(file, message, size) bind(c)
      import :: c_ptr, c_char, c_size_t
      character(kind=c_char), intent(in) :: file(*)
      character(kind=c_char) :: message(*)
      integer(c_size_t), value :: size
    end function
    integer(c_int) function jlaw_dim(law) bind(c)
      import :: c_ptr, c_int
      type(c_ptr), value :: law
    end function
    integer(c_int) function jlaw_state_size(law) bind(c)
      import :: c_ptr, c_int
      type(c_ptr), value :: law
    end function
    integer(c_int) function jlaw_update(law, s0, s1, d, F, C, message, size) bind(c)
      import :: c_ptr, c_int, c_double, c_char, c_size_t
      type(c_ptr), value :: law
      real(c_double) :: s0(*), s1(*), d(*), F(*) ! s0 and s1 may be the same
      type(c_ptr), value :: C                    ! c_null_ptr, or c_loc of 9 numbers, row by row
      character(kind=c_char) :: message(*)
      integer(c_size_t), value :: size
    end function
    subroutine jlaw_free(law) bind(c)
      import :: c_ptr
      type(c_ptr), value :: law
    end subroutine
  end interface
end module

program shear
  use jointlaw
  implicit none
  integer(c_size_t), parameter :: length = 300 ! JLAW_MESSAGE
  character(kind=c_char) :: message(length)
  type(c_ptr) :: law
  real(c_double), allocatable :: state(:)
  real(c_double) :: d(3), F(3)
  integer :: i

  law = jlaw_read('granite.jlaw'//c_null_char, message, length)
  if (.not. c_associated(law)) call stop_with_message()
  allocate (state(jlaw_state_size(law)), source=0.0_c_double) ! zeros: a virgin joint
  print '(a)', 'closure_um,shear_um,normal_MPa,shear_MPa'
  F = 0.0
  do i = 1, 20
    d = 0.0
    if (i <= 10) d(1) = 5e-8
    if (i > 10 .and. jlaw_dim(law) > 1) d(2) = 5e-8
    if (jlaw_update(law, state, state, d, F, c_null_ptr, message, length) /= 0) call stop_with_message()
    print '(*(f8.4, :, ","))', 1e6*state(1), 0.05*max(i - 10, 0), 1e-6*F(1), 1e-6*F(2)
  end do
  call jlaw_free(law)
contains
  subroutine stop_with_message() ! print the message, up to its terminating zero
    integer :: at
    print '(300a)', (message(at), at=1, findloc(message, c_null_char, dim=1) - 1)
    stop 1
  end subroutine
end program
